texel bake --implicit "sin(x) + cos(y)" -o x.texel
