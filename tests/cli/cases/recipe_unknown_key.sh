echo '{ "resolution": 8, "quality": 3 }' > recipe.json
texel bake "$DATA/cube.obj" -o out.texel --recipe recipe.json
