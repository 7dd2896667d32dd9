texel bake "$DATA/cube.obj" -o cube.texel --recipe "$DATA/small.json" || exit
rm cube.texel/slices/z/0003.png
texel check cube.texel
