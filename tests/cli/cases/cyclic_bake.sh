cp "$DATA/cube.obj" . && texel bake cube.obj -o out.texel --cyclic x,y --box=-1.25,-1,-2,1.25,1.5,2 -r 32 && texel check out.texel && texel view out.texel --truth -o truth.png && ls
