texel bake "$DATA/cube.obj" --implicit "0.3 - length(x - 2, y, z)" -r 24 --want density -o both.texel && texel check both.texel
