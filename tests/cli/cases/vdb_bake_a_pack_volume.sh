texel bake --implicit "1 - length(x, y, z)" -r 16 --want density,normal -o ball.texel || exit
texel bake ball.texel/volume.vdb --iso 1 -r 16 --want density -o again.texel && texel check again.texel
texel bake ball.texel/volume.vdb --iso 1e9 -r 16 -o x.texel
