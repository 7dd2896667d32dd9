texel bake --implicit "1 - lenght(x, y, z)" -o x.texel
