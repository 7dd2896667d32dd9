texel view "$DATA/cube.obj" -o cube.bmp
