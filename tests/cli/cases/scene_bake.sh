# One cube in two places, a third beside it: a pack, found up to date, and baked again from itself; a table of places that changes is noticed.
cp "$DATA"/cube.* .; printf '0,0,0\n3,0,0\n' > p.csv
printf '{"format": "texel-scene", "inputs": {"cube": "cube.obj", "big": {"file": "cube.obj", "materials": {"*": {"kd": "#204080"}}}},
 "objects": [{"input": "cube", "instances_file": "p.csv"}, {"input": "big", "transform": {"translate": [6, 0, 0], "scale": 2}}],
 "recipe": {"resolution": 16, "want": "density,color"}}' > s.json
texel bake s.json -o s.texel && texel bake s.json -o s.texel && texel bake --recipe s.texel -o again.texel && cmp s.texel/volume.vdb again.texel/volume.vdb
texel info s.texel | grep -E "source|resolution"
printf '0,0,0\n4,0,0\n' > p.csv; texel bake s.json -o s.texel -r 8
