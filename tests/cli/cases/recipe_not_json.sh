printf '{\n"samples": 4,\n' > recipe.json
texel bake "$DATA/cube.obj" -o out.texel --recipe recipe.json
