texel bkae cube.obj
