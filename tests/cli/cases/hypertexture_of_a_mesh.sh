texel bake "$DATA/cube.obj" --hypertexture fur -o fur.texel
