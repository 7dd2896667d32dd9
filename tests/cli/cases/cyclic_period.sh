texel bake "$DATA/cube.obj" -o out.texel --cyclic x,y --box=0,0,0,3,1.5,1 -r 63; status=$?; ls; exit $status
