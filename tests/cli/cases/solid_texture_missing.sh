texel bake "$DATA/cube.obj" --solid-texture none.png -o stone.texel
