# Below what the grids' floats hold (docs/pack-format.md): told before the bake.
printf 'v 0 0 0\nv 1e-300 0 0\nv 0 1e-300 0\nf 1 2 3\n' > tiny.obj
texel bake tiny.obj -o tiny.texel; echo $?
texel bake tiny.obj --plan; echo $?
ls -A
