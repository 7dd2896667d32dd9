texel bake --implicit "1 + x*x" --box 0,0,0,1,1,1 -o x.texel
