texel bake "$DATA/cube.obj" -o cube.texel --recipe "$DATA/small.json" --plan && ls
