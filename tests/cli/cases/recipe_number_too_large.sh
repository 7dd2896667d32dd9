printf '{"samples": 1e999}\n' > recipe.json
texel bake "$DATA/cube.obj" -o out.texel --recipe recipe.json
