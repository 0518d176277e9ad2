"""The report on a stage, with what USD's own validators say of it."""

import json
import shutil


def test_findings_of_usds_own_validators_are_in_the_report(small_stage, tmp_path, spin_usd) -> None:
    root = shutil.copytree(small_stage.parent, tmp_path / "stage") / small_stage.name
    (root.parent / "layers" / "variant_sets" / "rich.usda").unlink()
    report = json.loads(spin_usd("check", root, "--json", code=1).stdout)  # which is held to its schema
    assert any(each["code"].endswith(".UnresolvableDependency") for each in report["findings"])
