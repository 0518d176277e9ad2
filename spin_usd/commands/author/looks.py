"""Materials of the library on a target: by a user's table, or by the names and colours of its surfaces."""

import csv
import io
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

from spin_usd.basics.pluralise import pluralise
from spin_usd.commands.author.authoring import Authoring
from spin_usd.commands.author.options import AUTO
from spin_usd.errors import InputError
from spin_usd.files.new_file import write_whole
from spin_usd.formats.table_file import MATERIALS
from spin_usd.scene.derived.recognised_material import PAINT, UNKNOWN, Vocabulary, is_grey, recognised
from spin_usd.scene.name_rule import KEEP, WILD, Color, MaterialRule, Rules
from spin_usd.stage.author.looks import Finish, surfaces_of, takes_looks, write_looks
from spin_usd.stage.author.material_library import vocabulary
from spin_usd.stage.author.model_surfaces import ModelSurface, refuse_idle
from spin_usd.stage.usd.layer_file import writing

TABLE = "materials.csv"
SHOWN = 3  # surfaces named in a note, of each material


def give_materials(making: Authoring) -> None:
    """Give the target the requested materials, and note which. A target without materials, for which none were
    requested, gets those of `auto` in its look for the variant materials=rich, and stays grey otherwise. Raises
    InputError, OutputError."""
    additions, auto = making.sources.additions, making.options.materials == AUTO
    rules = (*additions.materials, *additions.part_materials)
    asked = auto or bool(rules)
    if not asked and not (takes_looks(making.target) and all(each.bare for each in surfaces_of(making.target))):
        return
    surfaces = list(surfaces_of(making.target))
    if auto or not asked:
        rules = rules_for(surfaces, rules)
    if auto:
        with writing(making.folder / TABLE):
            write_whole(making.folder / TABLE, table_text(rules).encode())
    first = Rules(rules).first
    chosen = {each: rule for each in surfaces if (rule := first(each.all_names))}
    refuse_idle(additions.materials, surfaces, set(chosen.values()), additions.files.get("materials"))
    if fixed := next((each for each, rule in chosen.items() if each.collected and rule.material != KEEP), None):
        found = f"a collection binds the material of {fixed.below}, which no other can be bound over"
        raise InputError(found, where=making.target.source_prim, do="keep it, or bind it without a collection")
    finished = {each: _finish(rule) for each, rule in chosen.items() if rule.material != KEEP}
    if asked:
        making.notes += _notes(finished, len(surfaces) - len(finished), auto=auto)
        making.notes += _unknown([surface.title for surface, rule in chosen.items() if rule.note == UNKNOWN])
    if finished:
        kept = [each for each in surfaces if each not in finished]
        making.target = write_looks(making.target, finished, kept, rich_alone=not asked)
        making.model_materials = {each.below: each.materials for each in finished}


def rules_for(surfaces: Sequence[ModelSurface], first: Sequence[MaterialRule] = ()) -> tuple[MaterialRule, ...]:
    """Return rules by which each surface that none of the `first` rules matches gets the material that it seems to be
    of: one for all that share a material's name, or a name of their own, where most agree; before them one for each
    that is another, by its path."""
    known = vocabulary()
    colors = {each.color for each in surfaces}
    default = next(iter(colors)) if len(colors) == 1 else None  # a grey that all of a model has was not chosen
    known_color = not (default and is_grey(default))
    given = Rules(first)
    rest = [each for each in surfaces if not given.first(each.all_names)]
    found = {each: _recognised(each, each.color if known_color else None, known) for each in rest}
    votes: dict[str, Counter[MaterialRule]] = {}
    for surface, rule in found.items():
        if surface.title != surface.title.strip() or not surface.title.isprintable() or WILD & set(surface.title):
            continue  # it can be no pattern that matches its own surfaces alone
        votes.setdefault(surface.title.lower(), Counter())[_named(surface.title, rule)] += 1
    shared = [counted.most_common(1)[0][0] for counted in votes.values()]
    apart: dict[ModelSurface, MaterialRule] = {}
    while True:
        deepest_first = sorted(apart.values(), key=lambda rule: -rule.pattern.count("/"))
        rules = (*first, *deepest_first, *shared)
        indexed = Rules(rules)
        matched = {each: indexed.first(each.all_names) for each in found}
        wrong = [each for each, rule in found.items() if each not in apart and _differ(rule, matched[each])]
        if not wrong:
            used = set(matched.values())
            return tuple(rule for rule in rules if rule in used or rule in first)
        apart |= {each: _named(each.below, found[each]) for each in wrong}


def _recognised(surface: ModelSurface, color: Color | None, known: Vocabulary) -> MaterialRule:
    if surface.collected or surface.patterned:
        return MaterialRule(pattern="", material=KEEP, note="it has images, or is not one opaque colour")
    return recognised(surface.names, () if surface.bare else surface.materials, color, known)


def _named(pattern: str, rule: MaterialRule) -> MaterialRule:
    return MaterialRule(pattern=pattern, material=rule.material, color=rule.color, note=rule.note)


def _differ(rule: MaterialRule, other: MaterialRule | None) -> bool:
    return other is None or _finish(rule) != _finish(other)


def _finish(rule: MaterialRule) -> Finish:
    return Finish(material=rule.material, color=rule.color, scale=rule.scale)


def table_text(rules: Sequence[MaterialRule]) -> str:
    """Return the rules as a CSV file that --materials takes."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow((MATERIALS.key, *MATERIALS.columns))
    for rule in rules:
        color = " ".join(f"{each:.4g}" for each in rule.color or ())
        writer.writerow((rule.pattern, rule.material, color, "" if rule.scale == 1 else rule.scale, rule.note))
    return text.getvalue()


def _notes(finished: Mapping[ModelSurface, Finish], kept: int, *, auto: bool) -> Iterator[str]:
    """Yield a note on which surfaces have which material."""
    by_material: dict[str, list[str]] = {}
    for surface, finish in finished.items():
        by_material.setdefault(finish.material, []).append(surface.title)
    for material, titles in by_material.items():
        yield f"{material}: {_listed(titles)}"
    if kept:
        yield f"{pluralise(kept, 'surface')} with the model's own materials"
    if auto:
        yield f"these materials are guesses: correct {TABLE} in the stage's folder, and give that as --materials"


def _unknown(titles: Sequence[str]) -> Iterator[str]:
    """Yield a note on the surfaces of these titles, whose material nothing tells."""
    if titles:
        told = "neither names nor colours tell the material"
        yield f"{PAINT} for want of knowledge: {told} of {_listed(titles)}; write keep in {TABLE} for the model's own"


def _listed(titles: Sequence[str]) -> str:
    names = list(dict.fromkeys(titles))
    more = f" and {pluralise(len(names) - SHOWN, 'more name')}" if len(names) > SHOWN else ""
    return f"{pluralise(len(titles), 'surface')} of {', '.join(names[:SHOWN])}{more}"
