texel bake --implicit "sign(1 - length(x, y, z))" --box -2,-2,-2,2,2,2 -r 16 --want density -o x.texel
