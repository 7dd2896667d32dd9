texel bake "$DATA/bad_index.obj" -o out.texel
