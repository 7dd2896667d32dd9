texel bake "$DATA/cut_short.ply" -o out.texel
