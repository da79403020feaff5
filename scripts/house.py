"""Print the size, the structure and the language of the code: lines, files, and private words.

Usage: python scripts/house.py [--words] [--files] [--below FOLDER]

Structure is what makes a reader open more files than needed: short files with one importer, file
names that are used often, circles of imports, named tuples of many fields.

Private words are those that a roboticist who knows Drake, MoveIt and the papers would not use;
`WORDS` lists them with the field's word. Identifiers are split at underscores and capitals first.
"""

from __future__ import annotations

import argparse
import ast
import re
import statistics
import subprocess
import sys
from collections import Counter
from pathlib import Path

import grimp

CHECKOUT = Path(__file__).resolve().parents[1]
# A file with fewer lines and one importer belongs into it; more files of one name say nothing.
SHORT, OFTEN = 60, 3
TEXT = {".py", ".md", ".yaml", ".toml", ".css"}
# The change log quotes the past, and this file quotes the words.
LEFT_OUT = {"CHANGELOG.md", "scripts/house.py", "LICENSE"}
WORDS = {
    r"ways? along|bends?\b(?! its| the knee)": "null-space direction, tangent; curvature",
    r"rooms?": "environment, scene; package, module",
    r"lanes?": "samples of the free joint",
    r"hunts?|looks? closer|closer looks?|looked closer": "search; refine",
    r"squeez(?:e|es|ed|ing)": "bisect",
    r"rides?|rides on": "torso-mounted",
    r"balls?(?! joint)": "bounding sphere",
    r"on loan|borrow(?:s|ed|ing)?|lent|lends?": "unowned view, non-owning reference",
    r"(?:mirrored|reversed|upright) arms?": "spherical-wrist or spherical-shoulder arm",
    r"told|tells?|telling|said|asks?|asked|asking": "message, reported, requested",
    r"a little off|off at random|rooms? off|how far off|m off|rad off": "error, pose error",
    r"(?:the|a|which|what) shares?(?= of| that)": "fraction, percentage",
    r"surest": "greatest lower confidence bound",
    r"rac(?:e|es|ed|ing)(?! condition)": "successive halving",
    r"cut offs?": "unreachable from here",
    r"lift(?:s|ed|ing)?": "torso height",
    r"turns? on and on|turning on and on|on and on": "continuous joint",
    r"driven arms?|who(?:m)?ever|who drives": "teleoperated arm, operator",
    r"reshap(?:e|es|ed|ing)": "self-motion, null-space motion",
    r"leash(?:es)?|ran ahead|runs? ahead": "target lead limit",
    r"wish(?:es|ed)?|situations?": "rate command, control state",
    r"wander(?:s|ed|ing)?": "Gauss-Markov process",
    r"clutch parts": "clutch decouples master and slave",
    r"folds?|folded|folding|unfold(?:s|ed|ing)?|packing": "compress, encode",
    r"twins?": "reference implementation",
    r"nobody|somebody": "(name the reader or the program)",
    r"kinds?": "type, class",
    r"(?:it|he|she) itself[.]|all of it[.]|is none of|is one way|the latter|the former(?! one)": (
        "(a sentence with a subject)"
    ),
    r"yardsticks?|safeguards?|way there|ways? from here|found to be|in hand|all but": (
        "(plain technical English)"
    ),
}
PATTERNS = {word: re.compile(rf"(?<![\w-])(?:{word})(?![\w])", re.IGNORECASE) for word in WORDS}
# Options and keys that other programs call, names of other packages, and words of the trade.
ALLOWED = re.compile(
    r"--ask\b|\.kind\b|\bkind=\"(?:stable|linear|cubic)\"|\bmanager, kind\b|torso[_ ]lift|"
    r"torso_lift\w*|shoulder_lift\w*|race condition|living room|head[- ]?room|"
    r"\.reshape\(|\bsqueeze=False|\boverflow=\"fold\"|parameter\.replace\(kind=|`kind`|"
    r"--lift\b",
    re.IGNORECASE,
)


def main() -> int:
    """Print the figures; with `--words`, each private word with file and line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--words", action="store_true", help="list every private word")
    parser.add_argument("--files", action="store_true", help="list files, names and circles too")
    parser.add_argument("--below", default="", help="only files whose path starts so")
    options = parser.parse_args()
    files = [path for path in tracked() if str(path).startswith(options.below)]
    for folder in ("tcs", "shapes", "studies", "tests"):
        sizes(folder, [path for path in files if path.parts[0] == folder])
    structure(options.files)
    found = [hit for path in files for hit in private_words(path)]
    if options.words:
        for path, number, word, better in found:
            print(f"{path}:{number}: {word} -> {better}")
    counts: dict[str, int] = {}
    for path, _, _, _ in found:
        top = "/".join(
            path.parts[: 3 if path.parts[0] in ("tcs", "tests") else 1][:-1] or path.parts
        )
        counts[top] = counts.get(top, 0) + 1
    for place, count in sorted(counts.items(), key=lambda item: -item[1]):
        print(f"{count:6} private words in {place}")
    print(f"{len(found):6} private words in all, {len(files)} files read")
    return 0


def tracked() -> list[Path]:
    """Return the text files that git tracks, from the checkout's root."""
    listed = subprocess.run(
        ["git", "ls-files"], cwd=CHECKOUT, check=True, capture_output=True, text=True
    ).stdout.splitlines()
    paths = (Path(line) for line in listed)
    return [p for p in paths if p.suffix in TEXT and str(p) not in LEFT_OUT and exists(p)]


def exists(path: Path) -> bool:
    """Return whether a tracked file is still there."""
    return (CHECKOUT / path).is_file()


def sizes(folder: str, files: list[Path]) -> None:
    """Print how many lines a folder has, and how long its modules and functions are."""
    modules, functions = [], []
    for path in files:
        if path.suffix != ".py":
            continue
        text = (CHECKOUT / path).read_text(encoding="utf-8")
        modules.append(len(text.splitlines()))
        functions += [
            node.end_lineno - node.lineno + 1
            for node in ast.walk(ast.parse(text))
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)) and node.end_lineno
        ]
    if modules and functions:
        print(f"{folder}: {len(modules)} modules, {sum(modules)} lines; {len(functions)} functions")
        for name, lengths in (("module", modules), ("function", functions)):
            median = statistics.median(lengths)
            ninth = statistics.quantiles(lengths, n=10)[-1] if len(lengths) > 1 else lengths[0]
            print(f"{folder}: {name} length: median {median:g}, 90th percentile {ninth:g} lines")


def structure(listed: bool) -> None:
    """Print how many short files, frequent names and circles `tcs` has, and its largest tuple."""
    sys.path.insert(0, str(CHECKOUT))
    graph = grimp.build_graph("tcs", cache_dir=None)
    paths = {module: path_of(module) for module in graph.modules}
    modules = {m: path for m, path in paths.items() if not path.name.startswith("__")}
    short = [
        (path, next(iter(importers), "nothing"))
        for module, path in sorted(modules.items())
        if len(importers := graph.find_modules_that_directly_import(module)) <= 1
        and len(path.read_text(encoding="utf-8").splitlines()) < SHORT
    ]
    names = Counter(path.name for path in modules.values())
    often = [f"{name} {count}" for name, count in names.most_common() if count > OFTEN]
    found = circles({m: graph.find_modules_directly_imported_by(m) for m in graph.modules})
    fields, largest = max(
        (sum(isinstance(line, ast.AnnAssign) for line in node.body), node.name)
        for path in paths.values()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ClassDef)
        and any(isinstance(base, ast.Name) and base.id == "NamedTuple" for base in node.bases)
    )
    print(f"tcs: {len(short)} files under {SHORT} lines with one importer")
    if listed:
        print("\n".join(f"  {path.relative_to(CHECKOUT)} <- {by}" for path, by in short))
    print(f"tcs: {len(often)} names of more than {OFTEN} files: {', '.join(often) or 'none'}")
    print(f"tcs: {len(found)} circles of imports, those for type checkers included")
    if listed:
        print("\n".join(f"  {' '.join(sorted(circle))}" for circle in found))
    print(f"tcs: largest named tuple {largest} with {fields} fields")


def path_of(module: str) -> Path:
    """Return the file of a module or package."""
    path = CHECKOUT.joinpath(*module.split("."))
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


def circles(imported: dict[str, set[str]]) -> list[list[str]]:
    """Return the strongly connected groups of two or more modules (Tarjan)."""
    number: dict[str, int] = {}
    lowest: dict[str, int] = {}
    open_: list[str] = []
    found: list[list[str]] = []

    def visit(module: str) -> None:
        number[module] = lowest[module] = len(number)
        open_.append(module)
        for other in imported[module]:
            if other not in number:
                visit(other)
            if other in open_:
                lowest[module] = min(lowest[module], lowest[other])
        if lowest[module] == number[module]:
            circle = open_[open_.index(module) :]
            del open_[-len(circle) :]
            if len(circle) > 1:
                found.append(circle)

    for module in sorted(imported):
        if module not in number:
            visit(module)
    return found


def private_words(path: Path) -> list[tuple[Path, int, str, str]]:
    """Return file, line, word and the field's word of every private word in a file."""
    hits = []
    lines = (CHECKOUT / path).read_text(encoding="utf-8").splitlines()
    for number, line in enumerate(lines, start=1):
        plain = ALLOWED.sub(" ", line)
        plain = re.sub(r"(?<=[a-z])(?=[A-Z])|_", " ", plain)
        for word, pattern in PATTERNS.items():
            hits += [(path, number, hit[0], WORDS[word]) for hit in pattern.finditer(plain)]
    return hits


if __name__ == "__main__":
    sys.exit(main())
