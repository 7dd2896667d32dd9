# Not a crash, wherever JSON is read.
python3 -c 'n = 300000; print("{\"format\": \"texel-shape\", \"shape\": " + "[" * n + "]" * n + "}")' > s.json
python3 -c 'n = 300000; print("{\"resolution\": " + "[" * n + "]" * n + "}")' > r.json
texel bake s.json -o x.texel; echo $?
texel bake "$DATA/cube.obj" -o x.texel --recipe r.json; echo $?
