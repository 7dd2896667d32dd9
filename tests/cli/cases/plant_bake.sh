# A leaf of 10 cm that tapers, and a diffuse alpha of 0, which must not make it vanish.
printf '%s' "<opf version='2.0'><meshBDD><mesh Id='1'><points>0 -.5 0 1 -.5 0 1 .5 0 0 .5 0</points><faces><face Id='0'>0 1 2 3</face></faces></mesh></meshBDD>
<materialBDD><material Id='4'><diffuse>0.2 0.6 0.1 0</diffuse></material></materialBDD><shapeBDD><shape Id='0'><meshIndex>1</meshIndex><materialIndex>4</materialIndex></shape></shapeBDD>
<topology><geometry><shapeIndex>0</shapeIndex><mat>10 0 0 0 0 1 0 0 0 0 1 5</mat><dUp>2</dUp><dDwn>4</dDwn></geometry></topology></opf>" > leaf.opf
texel bake leaf.opf -o leaf.texel -r 16 2>&1 | sed 's/, [0-9.]* s$//'
texel bake leaf.opf --plan -r 16 --unit m 2>&1 | grep -E 'triangles|box'
texel check leaf.texel
