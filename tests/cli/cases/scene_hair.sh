# Two places of a hair are two files: the same volume, to the byte.
wire() { printf '<scene><Curves type="round" basis="catmull_rom"><positions>%s</positions><indices>0 1</indices></Curves></scene>' "$1" > "$2"; }
wire '0 0 0 .0625  1 0 0 .0625  2 1 0 .0625  2 2 1 .0625  3 2 2 .03125' a.xml
wire '0 0 8 .125  0 2 8 .125  -2 4 8 .125  -4 4 10 .125  -4 6 12 .0625' b.xml
printf '%s' '{"format": "texel-scene", "inputs": {"hair": "a.xml"}, "objects": [{"input": "hair", "instances": [{}, {"scale": 2, "rotate": [0, 0, 90], "translate": [0, 0, 8]}]}]}' > s.json
texel bake s.json -o s.texel -r 48 --want density,color,ndf 2>&1 | sed 's/, [0-9.]* s$//'
texel bake a.xml b.xml -o two.texel -r 48 --want density,color,ndf 2>&1 | sed 's/, [0-9.]* s$//'
texel bake a.xml -o one.texel -r 48 --want density,color,ndf > /dev/null 2>&1
hash() { tr -d '\n ' < "$1.texel/manifest.json" | grep -o '"file":"volume.vdb"[^}]*' | head -1; }
[ "$(hash s)" = "$(hash two)" ] && echo same
[ "$(hash s)" = "$(hash one)" ] || echo different
