texel bake $DATA/cube.obj -o a.texel -r 8 --samples 4 2>/dev/null
texel bake $DATA/cube.obj -o b.texel -r 8 --samples 1 --ndf neyret 2>/dev/null
texel compare a.texel a.texel --allow alpha_rms=0 --allow color_max=0 --level 0
texel compare a.texel b.texel --json | python3 -c '
import json, sys
j = json.load(sys.stdin)
names = {m["name"] for m in j["measures"]}
print(j["pack"], j["against"], {"alpha_rms", "sigma_rms", "area_relative", "column_rms"} <= names)
print(all(m["low"] <= m["value"] <= m["high"] and m["unit"] and m["norm"] for m in j["measures"]))'
texel compare a.texel b.texel --allow alpha_rms=1 --allow sigma_rms=1e-9 --json > out.json
echo $?
