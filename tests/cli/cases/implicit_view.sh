texel view --implicit "1 - length(x, y, z)" --size 32x32 -o a.png && test -s a.png && echo drawn
texel view --implicit "1 - length(x, y, z)" --mode volume -o b.png
