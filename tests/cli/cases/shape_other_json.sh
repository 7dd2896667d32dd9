texel bake "$DATA/small.json" -o x.texel
