"""Puts the tables and plots of a full measurement into the documentation."""

import os
import re
import shutil
import sys


def tables_of(text):
    """What stands between the markers `<!-- accuracy: NAME -->` and `<!-- end -->`, by name."""
    pattern = r"<!-- accuracy: ([a-z-]+) -->\n(.*?)<!-- end -->"
    return dict(re.findall(pattern, text, re.S))


def update(source, docs):
    with open(os.path.join(source, "accuracy.md"), encoding="utf-8") as file:
        tables = tables_of(file.read())
    page = os.path.join(docs, "accuracy.md")
    with open(page, encoding="utf-8") as file:
        text = file.read()
    wanted = set(tables_of(text))
    if wanted - set(tables):
        sys.exit(f"run-accuracy: {page} asks for tables that were not made: "
                 + ", ".join(sorted(wanted - set(tables))))
    for name in wanted:
        begin = f"<!-- accuracy: {name} -->\n"
        head, rest = text.split(begin, 1)
        text = head + begin + tables[name] + "<!-- end -->" + rest.split("<!-- end -->", 1)[1]
    with open(page + ".new", "w", encoding="utf-8") as file:
        file.write(text)
    os.replace(page + ".new", page)
    pictures = os.path.join(docs, "accuracy")
    os.makedirs(pictures, exist_ok=True)
    for name in sorted(os.listdir(source)):
        if name.endswith(".svg"):
            shutil.copyfile(os.path.join(source, name), os.path.join(pictures, name))
    print(f"   {page} and {pictures} are up to date")
