texel bake --implicit "1 - length(x, y, z)" -r 16 --want density,slices --slices z -o ball.texel || exit
texel check ball.texel && texel bake --recipe ball.texel -o again.texel && diff -r ball.texel again.texel && echo the same
texel bake --implicit "1 - length(x, y, z)" -r 16 --want density,slices --slices z -o ball.texel
