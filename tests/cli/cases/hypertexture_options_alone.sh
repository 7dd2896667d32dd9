texel bake "$DATA/cube.obj" --softness 0.1 -o cube.texel
