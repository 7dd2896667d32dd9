texel bake --implicit "max(1 - length(x, y, z), 0.5 - length(x - 2, y, z))" -r 32 --plan
