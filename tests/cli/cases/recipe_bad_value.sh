echo '{ "samples": 0 }' > recipe.json
texel bake "$DATA/cube.obj" -o out.texel --recipe recipe.json
