texel bench "$DATA/cube.obj" --out found -r 6,8 --samples 2,4 --rays 4,16,64 --errors 0.05,0.02 --repeat 1 --voxels 40 | cut -c1-28 | grep -E '^(method|bundle|error|random|exact|SGGX|Ratib|whole pack)' | sort -u
ls found
python3 - <<'END'
import json, xml.etree.ElementTree as tree, glob
j = json.load(open("found/bench.json"))
print(j["format"], j["scene"], len(j["runs"]), [r["method"] for r in j["runs"] if r["default"]])
print(all(r["cpu_seconds"] > 0 and r["peak_bytes"] > 1e6 and r["pack_bytes"] > 0 for r in j["runs"]))
error = {(r["method"], r["value"], r["resolution"]): r["errors"]["alpha_rms"]["value"] for r in j["runs"] if "alpha_rms" in r["errors"]}
print(sorted(r["value"] for r in j["runs"] if r["method"] == "asked" and r["errors"]["alpha_rms"]["value"] <= r["value"]))
print(error["grid", 4, 8] <= error["random", 64, 8])
for name in sorted(glob.glob("found/*.svg")):
    root = tree.parse(name).getroot()
    assert root.tag.endswith("svg") and "nan" not in open(name).read(), name
END
texel bench "$DATA/cube.obj"; echo $?
texel bench -o found; echo $?
texel bench "$DATA/cube.obj" -o found -r 8,none; echo $?
texel bench "$DATA/cube.obj" -o found --errors 0.02,0; echo $?
texel bench nothing.obj -o found; echo $?
texel bench-run grid; echo $?
