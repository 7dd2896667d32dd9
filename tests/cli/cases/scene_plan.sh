cp "$DATA"/cube.* .; printf 'x y z\n0 0 0\n3 0 0\n' > p.csv
echo '{"format": "texel-scene", "inputs": {"cube": "cube.obj"}, "objects": [{"input": "cube", "instances_file": "p.csv"}]}' > s.json
texel bake s.json --plan -r 16
