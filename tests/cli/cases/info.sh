cp "$DATA"/cube.* .
texel bake cube.obj -o cube.texel --recipe "$DATA/small.json" && texel info cube.texel &&
texel info cube.texel --json | python3 -c "import json, sys; print(' '.join(json.load(sys.stdin)))"
