texel bake "$DATA/cube.obj" --solid-texture a.png,b.png -o stone.texel
