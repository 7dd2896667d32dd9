texel bake "$DATA/cube.obj" --solid-size 2 -o stone.texel
