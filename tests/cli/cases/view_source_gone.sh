texel bake "$DATA/cube.obj" -o cube.texel --recipe "$DATA/small.json" && texel view cube.texel -o cube.png --truth
