#!/usr/bin/env python3
"""Counts of the sources that may only fall: long functions, named constants, words of no robotics book.

  counts.py SOURCE           compares with SOURCE/tests/style/ceilings.json, exit 1 where one is exceeded
  counts.py SOURCE --write   lowers the ceilings to what is counted
"""
import json
import pathlib
import re
import sys

FOLDERS = "models sensors frontend backend testing grid io sim viewer pipeline apps".split()
NOT_CODE = re.compile(r'//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])\'', re.S)
CONSTANT = re.compile(r"\b(?:constexpr|const)\s+[\w:<>, ]+?\s+k[A-Z]\w*\s*[={]")
DIALECT = set("hear hears heard believe believes believed told heir heirs remount lawful whisker".split())
# In names and comments alike: sensors measure and observe, estimates are accepted, rejected, uncertain; things lie
# after, beyond, at a distance (docs/guide/glossary.md).
LOOSE = re.compile(r"hear[ds]?|hearings?|doubt[a-z]*|believ[a-z]*|told|looks|apart|behind")


def code_of(text):
    """The text with comments and literals blanked, its lines kept."""
    return NOT_CODE.sub(lambda m: " " + "\n" * m[0].count("\n"), text)


def lengths(code):
    """Lines of each function's body, by what stands before its brace at the depth of a scope."""
    depth_is_scope, head, line, opened = [], "", 1, []
    for c in code:
        line += c == "\n"
        if c == "{":
            words = " ".join(head.split())
            scope = bool(re.search(r"\b(namespace|struct|class|enum|union)\b[^()]*$", words))
            function = not scope and words.endswith((")", "const", "override", "noexcept")) or re.search(
                r"\)\s*(?:const)?\s*(?:->|:)[^=]*$", words)
            depth_is_scope.append(scope)
            opened.append(line if function and all(depth_is_scope[:-1]) else None)
            head = ""
        elif c == "}":
            if opened:
                depth_is_scope.pop()
                if (first := opened.pop()) is not None:
                    yield line - first + 1
            head = ""
        elif c == ";":
            head = ""
        else:
            head += c


def count(source):
    counts = {"functions over 60 lines": 0, "functions over 40 lines": 0, "words of the dialect": 0,
              "words where the field has its own": 0}
    for folder in FOLDERS:
        constants = 0
        for file in sorted((source / folder).rglob("*.[ch]pp")):
            text = file.read_text()
            counts["words where the field has its own"] += sum(
                bool(LOOSE.fullmatch(part.lower())) for part in re.findall(r"[A-Z]?[a-z]+", text))
            code = code_of(text)
            constants += len(CONSTANT.findall(code))
            for length in lengths(code):
                counts["functions over 60 lines"] += length > 60
                counts["functions over 40 lines"] += length > 40
            for word in re.findall(r"[A-Za-z_]\w+", code):
                parts = {p.lower() for p in re.findall(r"[A-Z]?[a-z]+", word)}
                counts["words of the dialect"] += bool(parts & DIALECT)
        counts[f"named constants in {folder}"] = constants
    return counts


def main():
    source = pathlib.Path(sys.argv[1])
    file = source / "tests/style/ceilings.json"
    counts = count(source)
    if "--write" in sys.argv:
        before = json.loads(file.read_text()) if file.exists() else {}
        file.write_text(json.dumps({k: min(n, before.get(k, n)) for k, n in counts.items()}, indent=1) + "\n")
        return 0
    ceilings = json.loads(file.read_text())
    above = 0
    for what, n in counts.items():
        ceiling = ceilings.get(what, 0)
        print(f"{what}: {n} (at most {ceiling})")
        above += n > ceiling
    return 1 if above else 0


sys.exit(main())
