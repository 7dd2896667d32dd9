touch file; texel bake "$DATA/cube.obj" -o file/cube.texel --recipe "$DATA/small.json"
