"""SECURITY.md promises nothing that no test holds."""

import ast
import re
from functools import cache

import pytest

from tests.conftest import REPOSITORY

PAGE = (REPOSITORY / "SECURITY.md").read_text()
# How a promise begins, in the table or in a sentence beside it, and tests that hold it.
TESTS = {
    "name a file outside its folder": [
        "stage/composition/test_open_stage.py::test_paths_that_leave_the_stage_are_refused_before_opening",
        "stage/composition/test_open_layer.py::test_a_target_takes_in_files_of_its_own_folder_only",
        "hostile/test_outside.py::test_a_target_takes_no_file_from_outside_its_folder",
        "commands/author/test_converted_models.py::test_a_model_takes_plain_files_of_its_own_folder_alone",
    ],
    "name a URL or another scheme": [
        "stage/composition/test_open_stage.py::test_paths_that_leave_the_stage_are_refused_before_opening",
        "test_security.py::test_nothing_here_imports_what_connects_to_a_network",
    ],
    "in a dataset, name a file outside it": [
        "files/test_folder.py::test_schemas_hold_the_same_pattern_of_names",
        "files/test_folder.py::test_nothing_outside_is_written_or_removed",
        "hostile/test_outside.py::test_a_stage_that_a_dataset_names_elsewhere_is_not_opened",
        "hostile/test_outside.py::test_files_that_a_record_names_elsewhere_are_not_hashed",
    ],
    "be a pipe, a device or a folder": [
        "files/test_user_file.py::test_every_reader_refuses_pipes_and_devices_at_once",
        "hostile/test_waiting.py::test_a_pipe_in_a_dataset_is_refused_by_render",
    ],
    "hold a value of a wrong or unknown type": [
        "hostile/test_damaged_input.py::test_a_value_of_another_type_or_an_extreme_one_is_told",
    ],
    "multiply by references": [
        "stage/composition/test_open_layer.py::test_a_stage_is_counted_before_it_is_composed",
        "test_bad_inputs.py::test_a_stage_that_multiplies_without_end_is_refused",
        "hostile/test_waiting.py::test_doubling_references_in_a_target_end_and_leave_nothing",
    ],
    "be huge": [
        "stage/composition/test_open_layer.py::test_a_layer_of_text_is_bounded",
        "stage/composition/test_open_layer.py::test_prims_do_not_nest_deeper_than_they_can_be_walked",
        "stage/composition/test_images.py::test_one_image_has_a_limit",
        "files/test_user_file.py::test_size_is_bounded_before_anything_is_read",
        "hostile/test_waiting.py::test_large_inputs_end_within_their_time",
    ],
    "never finish opening": [
        "processes/test_patience.py::test_a_child_that_runs_away_or_hangs_is_ended_and_it_is_said_which",
    ],
    "take all memory": [
        "processes/test_child_limits.py::test_every_child_has_a_limit_and_leaves_no_core_file",
        "processes/test_child_limits.py::test_a_child_takes_no_more_than_whoever_started_us_allows",
    ],
    "crash USD, Blender or a decoder": [
        "processes/test_child.py::test_a_killed_child_is_reported_and_does_not_hang",
        "commands/render/test_render.py::test_kills_of_blender_lose_nothing",
        "hostile/test_damaged_input.py::test_pictures_that_cannot_be_decoded_are_findings_and_others_are_found_too",
    ],
    "nest values without end": [
        "basics/test_nesting.py::test_deep_json_is_refused_before_it_is_parsed",
        "basics/test_nesting.py::test_deep_toml_is_refused_soon",
    ],
    "be a web page, open in your browser": [
        "commands/keypoints/test_guarded_server.py::test_only_its_own_page_may_ask_it",
        "commands/keypoints/test_guarded_server.py::test_it_listens_on_this_machine_alone",
        "browser/test_own_page.py::test_who_is_our_own_page",
        "commands/watch/test_watch.py::test_strangers_are_refused",
    ],
    "have a name that forges lines": [
        "hostile/test_names_and_streams.py::test_a_file_name_forges_no_line_and_no_colour"
    ],
    "damage a mesh or a texture": ["stage/composition/test_images.py::test_what_is_no_image_is_refused_by_name"],
    "change the environment": [
        "processes/test_child.py::test_the_childs_environment_holds_nothing_that_could_change_a_picture"
    ],
    "use a memory fault in USD": [
        "test_confinement.py::test_children_of_a_command_write_in_its_folders_alone",
        "test_confinement.py::test_children_that_last_write_a_log_at_most",
        "test_confinement.py::test_nothing_else_is_without_a_limit",
        "processes/test_confine.py::test_files_are_written_in_one_folder_and_nowhere_else",
    ],
    "make `render` overwrite or delete": [
        "store/test_nothing_lost.py::test_look_alikes_of_all_our_names_stay",
        "hostile/test_users_files.py::test_a_render_into_a_dataset_with_names_like_temporary_ones",
        "hostile/test_outside.py::test_pruning_follows_no_link",
    ],
    "Your own paths": ["files/test_user_file.py::test_a_link_of_the_user_is_followed"],
    "No Python code, Blender file": ["test_security.py::test_nothing_here_runs_code_that_it_reads"],
}
ROW = re.compile(r"^\| (?!---|a hostile file could)(.+?) \|", re.MULTILINE)
SENTENCE = re.compile(r"^(Your own paths|No Python code).*", re.MULTILINE)
RUNS_CODE = re.compile(r"eval|exec|compile|__import__|pickle\.\w+|.*\.(open_mainfile|libraries\.load)")
WRITTEN_BY_US = {"blend_file.py"}  # it opens the file that it has just saved, to see that it is whole
LISTENS = {"guarded_server.py", "own_page.py"}  # they take `socket` to be asked, not to ask
CONNECTS = {"socket", "http.client", "urllib.request", "requests", "ftplib", "smtplib"}


def promises():
    """The first cells of the table's rows, and the sentences below it that promise something."""
    guarded = PAGE.partition("## What is guarded")[2].partition("## What is not guarded")[0]
    return [*ROW.findall(guarded), *(found.group() for found in SENTENCE.finditer(guarded))]


def test_each_promise_has_a_test_and_each_entry_a_promise() -> None:
    unheld = [promise for promise in promises() if not any(promise.startswith(words) for words in TESTS)]
    unsaid = [words for words in TESTS if not any(promise.startswith(words) for promise in promises())]
    assert (unheld, unsaid) == ([], [])


@pytest.mark.parametrize("test", sorted({test for tests in TESTS.values() for test in tests}))
def test_the_tests_are_there(test) -> None:
    file, _, name = test.partition("::")
    tree = ast.parse((REPOSITORY / "tests" / file).read_text())
    assert name in {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}


@cache
def modules():
    return {path: ast.parse(path.read_text()) for path in sorted((REPOSITORY / "spin_usd").rglob("*.py"))}


def test_nothing_here_runs_code_that_it_reads() -> None:
    """Nor opens what could hold some: Blender's files, and pickles in arrays."""
    calls = [
        f"{path.name}:{call.lineno}: {ast.unparse(call)[:80]}"
        for path, tree in modules().items()
        if path.name not in WRITTEN_BY_US
        for call in (node for node in ast.walk(tree) if isinstance(node, ast.Call))
        if RUNS_CODE.fullmatch(ast.unparse(call.func)) or "allow_pickle=True" in ast.unparse(call)
        if "use_scripts=False" not in ast.unparse(call)  # Blender's own switch for a .blend of a stranger
    ]
    assert calls == []


def test_nothing_here_imports_what_connects_to_a_network() -> None:
    """But a cluster's own room, which speaks with the machines that the user names, and what serves our own pages."""
    found = [
        f"{path.name}: {name}"
        for path, tree in modules().items()
        for node in ast.walk(tree)
        for name in _imported(node)
        if name in CONNECTS and "cluster" not in path.parts and not (name == "socket" and path.name in LISTENS)
    ]
    assert found == []


def _imported(node):
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    return [node.module or ""] if isinstance(node, ast.ImportFrom) else []
