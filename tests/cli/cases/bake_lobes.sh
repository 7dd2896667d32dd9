# Two leaves that cross, in one voxel: one lobe takes them for a cylinder, two are exact. Recipes, packs, check and compare know of it; the default says nothing of it.
{
  printf 'v 0.1 0.1 0.5\nv 0.9 0.1 0.5\nv 0.9 0.9 0.5\nv 0.1 0.9 0.5\n'
  printf 'v 0.1 0.5 0.1\nv 0.9 0.5 0.1\nv 0.9 0.5 0.9\nv 0.1 0.5 0.9\n'
  printf 'f 1 2 3 4\nf 5 6 7 8\n'
} > leaves.obj
bake() { texel bake leaves.obj -o "$@" --box 0,0,0,1,1,1 -r 1 --want ndf; }
bake one.texel
bake two.texel --lobes 2
texel check two.texel
texel compare two.texel --level 0 --columns 1 --allow sigma_max=0.002 > out.txt; echo "exit $?"
texel compare one.texel --level 0 --columns 1 --allow sigma_max=0.2 > out.txt; echo "exit $?"
grep -c share_1 two.texel/manifest.json one.texel/manifest.json
grep -c '"lobes"' two.texel/manifest.json one.texel/manifest.json
texel bake --recipe two.texel leaves.obj -o again.texel && diff -r two.texel/volume.vdb again.texel/volume.vdb
texel bake leaves.obj -o none.texel -r 4 --want color --lobes 2 -v 2>&1 | grep -- '--lobes'
bake no.texel --lobes 3; echo "exit $?"
bake no.texel --lobes 2 --ndf neyret; echo "exit $?"
bake no.texel --lobes 2 --normals visible; echo "exit $?"
texel bake --hypertexture eroded -r 16 -o no.texel --lobes 2; echo "exit $?"
