# A branch between two leaves: with all surface it colours the voxel, with what is seen it does not. Recipes, packs and compare know of it.
printf 'newmtl leaf\nKd 0 0.5 0\nnewmtl branch\nKd 0.5 0 0\n' > plant.mtl
{
  echo 'mtllib plant.mtl'
  for z in 0.2 0.5 0.8; do printf 'v 0 0 %s\nv 1 0 %s\nv 1 1 %s\nv 0 1 %s\n' $z $z $z $z; done
  printf 'usemtl leaf\nf 1 2 3 4\nf 9 10 11 12\nusemtl branch\nf 5 6 7 8\n'
} > plant.obj
bake() { texel bake plant.obj -o "$@" --box 0,0,0,1,1,1 -r 1 --want color,density; }
bake all.texel
bake visible.texel --material visible
texel compare visible.texel --level 0 --allow color_rms=0.001 --columns 1 | grep -E '^color_rms'
texel compare visible.texel all.texel -v | grep -E '^color_max' | sed 's/  */ /g'
texel bake --recipe visible.texel plant.obj -o again.texel && diff -r visible.texel/volume.vdb again.texel/volume.vdb
bake none.texel --material some || echo "exit $?"
texel bake --hypertexture eroded -r 16 -o rock.texel --material visible || echo "exit $?"
