texel bake "$DATA/cube.obj" --solid-texture cheese -o stone.texel
