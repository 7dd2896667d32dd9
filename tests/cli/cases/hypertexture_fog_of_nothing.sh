texel bake --hypertexture fog -o fog.texel
