texel bake "$DATA/bad_number.off" -o out.texel
