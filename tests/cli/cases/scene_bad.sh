cp "$DATA"/cube.* .
say() { printf '{"format": "texel-scene", "inputs": {"cube": "cube.obj"}, %s}' "$1" > s.json; texel bake s.json -o x.texel; echo $?; }
say '"objects": [{"input": "cube", "transform": {"scale": 0}}]'
say '"objects": [{"input": "cub"}]'
say '"objects": [{"input": "cube", "instances_file": "p.csv"}]'
say '"objects": [{"input": "cube"}], "recipe": {"resolutoin": 3}'
say '"texels": [{"name": "a", "objects": [{"input": "cube"}], "recipe": {"resolution": 0}}]'
echo '{"format": "texel-scene",' > s.json; texel bake s.json -o x.texel; echo $?
texel batch s.json -o out > /dev/null; echo $?
texel bake none.json -o x.texel; echo $?
