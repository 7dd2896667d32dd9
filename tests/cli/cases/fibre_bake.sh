# Lines alone, with and without a radius; a lone line is a scene.
printf 'v 0 0 0\nv 1 0.2 0.1\nv 1.5 1 0\nl 1 2 3\n' > lines.obj
texel bake lines.obj -r 16 --want density,ndf -o a.texel
texel bake lines.obj -r 16 --want density,ndf --fibre-radius 0.01 -o b.texel
texel check b.texel
texel bake lines.obj --fibre-radius 0 -o c.texel || echo "exit $?"
texel bake lines.obj --fibre-radius 0.02 --plan -r 16
texel bake lines.obj --fibre-radius -1 -o d.texel || echo "exit $?"
printf 'HAIR' > short.hair
texel bake short.hair -o e.texel || echo "exit $?"
