texel bake --implicit "1 - length(x, y, z) + 0*sqrt(x)" --box -2,-2,-2,2,2,2 -r 16 --want density -o x.texel
