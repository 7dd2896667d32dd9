texel bake "$DATA/cube.obj" -o cube.texel -r 8 --voxel-size 0.1
