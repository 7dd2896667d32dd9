head -c 156 /dev/zero > p.lig; texel bake p.lig -o x.texel
