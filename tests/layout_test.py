#!/usr/bin/env python3
"""The rules of docs/architecture.md that a compiler does not know: who may include whom, where outside libraries appear, how
long a file may be, and that every stage header says which stage it is. Usage: layout_test.py SOURCE_FOLDER"""
import os
import re
import sys

AREAS = ("formats", "bake", "cli")  # each may include itself and what stands before it
MOST_LINES = 800

# Library -> what its headers look like. Where they may appear is read from the table in docs/architecture.md.
LIBRARIES = {
    "OpenImageIO": r"OpenImageIO/",
    "OpenVDB": r"(openvdb|nanovdb)/",
    "libpng": r"png\.h$",
    "Embree": r"embree\d*/",
    "CGAL": r"CGAL/",
    "OpenMesh": r"OpenMesh/",
    "CLI11": r"CLI/",
    "nlohmann-json": r"nlohmann/",
    "OpenSSL": r"openssl/",
    "zlib": r"zlib\.h$",
    "libdeflate": r"libdeflate\.h$",
    "expat": r"expat\.h$",
    "Draco": r"draco/",
    "meshoptimizer": r"meshoptimizer\.h$",
}


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def sources(root, folders):
    for folder in folders:
        for here, _, names in os.walk(os.path.join(root, folder)):
            for name in sorted(names):
                if name.endswith((".h", ".cpp", ".py", ".cmake", ".txt", ".sh")):
                    yield os.path.relpath(os.path.join(here, name), root)


def includes(text):
    return re.findall(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', text, re.MULTILINE)


def allowed_files(architecture):
    """From the table rows `| Library: `file`, `file` | why |`."""
    allowed = {}
    for line in architecture.splitlines():
        row = re.match(r"\|\s*([\w, -]+?)\s*(?:\([^)]*\))?:\s*(.*?)\s*\|", line)
        if row and row.group(1) in LIBRARIES:
            allowed[row.group(1)] = re.findall(r"`([^`]+[./][^`]*)`", row.group(2))
    return allowed


def check(root):
    faults = []
    allowed = allowed_files(read(os.path.join(root, "docs/architecture.md")))
    for library in LIBRARIES:
        if library not in allowed:
            faults.append(f"docs/architecture.md: no row says where {library} may appear")
    for path in sources(root, AREAS + ("tests", "cmake", "samples", "tools")):
        text = read(os.path.join(root, path))
        lines = text.count("\n") + 1
        if lines > MOST_LINES:
            faults.append(f"{path}: {lines} lines, more than {MOST_LINES}")
        area = path.split("/")[0]
        if area not in AREAS:
            continue
        for include in includes(text):
            target = include.split("/")[0]
            if target in AREAS and AREAS.index(target) > AREAS.index(area):
                faults.append(f"{path}: includes {include}, but {area} comes before {target}")
            for library, pattern in LIBRARIES.items():
                if re.match(pattern, include) and path not in allowed.get(library, []):
                    faults.append(f"{path}: includes {include}, which docs/architecture.md does not allow there")
    faults += check_stages(root)
    return faults


def check_stages(root):
    """Every stage has its header, and its second line says so."""
    faults, stage_of = [], {}
    folder = os.path.join(root, "bake")
    headers = [name[:-2] for name in sorted(os.listdir(folder)) if name.endswith(".h")]
    for name in headers:
        line = read(os.path.join(folder, name + ".h")).splitlines()[1]
        if not line.startswith("// "):
            faults.append(f"bake/{name}.h: line 2 does not say what the file is for")
        if line.startswith("// Stage"):
            stage = re.match(r"// Stage (\d+)[a-z]?: \S", line)
            if stage:
                stage_of[name] = int(stage.group(1))
            else:
                faults.append(f'bake/{name}.h: line 2 is not of the form "// Stage k: A -> B"')
    for stage in range(1, 9):
        if stage not in stage_of.values():
            faults.append(f"bake: no header says that it is stage {stage}")
    return faults


def self_test():
    """The rules must be able to fail."""
    assert includes('#include "bake/view.h"\n # include <CGAL/x.h>\n// #include "no"') == ["bake/view.h", "CGAL/x.h"]
    table = "| libpng: `formats/image.cpp` | why |\n| CGAL (GPL): `bake/exact.cpp`, target `texel_exact` | why |"
    assert allowed_files(table) == {"libpng": ["formats/image.cpp"], "CGAL": ["bake/exact.cpp"]}, allowed_files(table)


if __name__ == "__main__":
    self_test()
    found = check(sys.argv[1])
    print("\n".join(found) if found else "layout: good")
    sys.exit(1 if found else 0)
