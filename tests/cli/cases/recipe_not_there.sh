texel bake "$DATA/cube.obj" -o out.texel --recipe recipe.json
