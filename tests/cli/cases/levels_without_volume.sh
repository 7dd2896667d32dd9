texel bake "$DATA/cube.obj" -o cube.texel --recipe "$DATA/small.json" --want slices,levels && ls cube.texel
