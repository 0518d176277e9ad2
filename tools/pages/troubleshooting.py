"""The page that says what to do: about every rule of `check`, and every message of an error, or of a finding that
`author` and `render` note, in the package's source."""

import ast
import inspect
import re
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

from pages.markdown import cell, table

from spin_usd import errors
from spin_usd.commands.check.rules import DATASET, FOREIGN, RULES, STAGE

PACKAGE = Path(errors.__file__).parent
KINDS = {name for name, kind in inspect.getmembers(errors, inspect.isclass) if issubclass(kind, errors.SpinError)}
VALUE = "…"
"""What stands for what differs from one error to the next."""
HEAD = f"""# Troubleshooting

Paste a message, or write some of its words. In the table, {VALUE} stands for names and numbers. Of a finding of
`spin-usd check` its code is enough; codes that are not here are those of OpenUSD's own validators.

```{{raw}} html
<p><input id="message" type="search" placeholder="A message, a code, or some words" style="width: 100%"></p>
<script>
addEventListener("DOMContentLoaded", () => {{
  const piecesOf = text => text.toLowerCase().split("{VALUE}").map(each => each.trim()).filter(each => each.length > 2);
  const rows = [...document.querySelectorAll("article tbody tr")]
    .map(row => [row, row.innerText.toLowerCase(), piecesOf(row.cells[0].innerText)]);
  document.getElementById("message").addEventListener("input", event => {{
    const asked = event.target.value.toLowerCase().trim(), words = asked.split(/\\s+/);
    const alike = rows.map(([, text, pieces]) => words.every(word => text.includes(word)) ? Infinity
      : pieces.every(piece => asked.includes(piece)) ? pieces.join("").length : 0);
    const least = Math.max(Math.max(...alike) / 2, 1);
    rows.forEach(([row], place) => row.hidden = alike[place] < least);
  }});
}});
</script>
```
"""


def page() -> str:
    """Return the page, in Markdown."""
    lines = [HEAD]
    ours = (("Findings on a stage", STAGE), ("Findings on a dataset", DATASET))
    for title, rules in (*ours, ("Findings on a third-party data set", FOREIGN)):
        rows = ((f"`{code}`", cell(rule.meaning), cell(rule.remedy)) for code, rule in rules.items())
        lines += [f"## {title}\n", table(("code", "meaning", "what to do"), rows), ""]
    said = table(("message", "what to do"), ((cell(found), cell(do)) for found, do in messages()))
    return "\n".join([*lines, "## Messages\n", said, ""])


def messages() -> list[tuple[str, str]]:
    """Return what each error and each finding of the package says and what to do about it, by its text; "" where the
    text says that."""
    found = {pair for file in PACKAGE.rglob("*.py") for pair in _messages_of(file)}
    return sorted(found, key=lambda pair: (re.sub(r"\W+", " ", pair[0]).strip().lower(), pair))


def _messages_of(file: Path) -> Iterator[tuple[str, str]]:
    tree = ast.parse(file.read_text())
    for function in (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)):
        for call in (node for node in ast.walk(function) if isinstance(node, ast.Call)):
            kind, given = ast.unparse(call.func), {keyword.arg: keyword.value for keyword in call.keywords}
            noted = kind == "Finding" and {"code", "message"} <= set(given)
            if not (noted or (kind.rpartition(".")[2] in KINDS and call.args)):
                continue
            names = {**_constants(file), **_assigned(function, call.lineno)}
            text = _text(given["message"] if noted else call.args[0], names)
            do = _text(given.get("code" if noted else "do", ast.Constant("")), names)
            if noted:
                do = RULES[do].remedy if do in RULES else ""
            if len(re.findall(r"[^\W\d]+", text)) > 1:
                yield text, re.sub(rf"^{VALUE}$", "", do)


@cache
def _constants(file: Path) -> Mapping[str, ast.expr]:
    """Return what the module's own names, and those that it imports of the package, stand for."""
    found: dict[str, ast.expr] = {}
    for node in ast.parse(file.read_text()).body:
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("spin_usd."):
            source = PACKAGE.parent / f"{(node.module or '').replace('.', '/')}.py"
            held = _constants(source) if source.is_file() else {}
            found |= {each.asname or each.name: held[each.name] for each in node.names if each.name in held}
        else:
            found |= dict(_assignments(node))
    return found


def _assigned(function: ast.FunctionDef, line: int) -> dict[str, ast.expr]:
    """Return what the names of the function were last given before that line."""
    nodes = sorted((node for node in ast.walk(function) if isinstance(node, ast.stmt)), key=lambda node: node.lineno)
    return {name: value for node in nodes if node.lineno <= line for name, value in _assignments(node)}


def _assignments(node: ast.stmt) -> Iterator[tuple[str, ast.expr]]:
    if not isinstance(node, ast.Assign):
        return
    for target in node.targets:
        pairs = [(target, node.value)]
        if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
            pairs = list(zip(target.elts, node.value.elts, strict=True))
        yield from ((name.id, value) for name, value in pairs if isinstance(name, ast.Name))


def _text(node: ast.expr, names: Mapping[str, ast.expr]) -> str:
    """Return the text that the expression makes, with VALUE for what is not known before it runs."""
    match node:
        case ast.Constant(value=str() as text):
            return text
        case ast.JoinedStr(values=parts):
            return re.sub(rf"'?{VALUE}('?\s*{VALUE})*'?", VALUE, "".join(_text(part, names) for part in parts))
        case ast.FormattedValue(value=ast.Name() as name):
            return _text(name, names) if name.id.isupper() else VALUE
        case ast.Name(id=name) if name in names:
            return _text(names[name], {each: value for each, value in names.items() if each != name})
        case ast.IfExp(body=body):
            return _text(body, names)
    return VALUE
