bake() { texel bake "$DATA/cube.obj" -o cube.texel --recipe "$DATA/small.json" "$@"; }
bake && bake && bake --force && bake --samples 3
