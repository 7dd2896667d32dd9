# A pack of a scene of plants is baked again from the scene alone, not from its plants as well.
printf '<gwa><mesh><points>0 0 0 1 0 0 0 1 0</points><faces>0 1 2</faces></mesh></gwa>' > a.gwa
printf '1\t1\ta.gwa\t5\t0\t0\t1\t0\t0\t0\n' > s.ops
texel bake s.ops -o s.texel -r 8 --want density && texel bake --recipe s.texel -o again.texel && texel info again.texel | grep -E "box|resolution"
