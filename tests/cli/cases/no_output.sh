texel bake "$DATA/cube.obj"
