/* Joins a run as any DDS program can, shows how far it is, and stops it. Usage: join_example DOMAIN */
#include <dds/dds.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include "public.h"

int main(int count, char** words) {
  const dds_domainid_t domain = count > 1 ? (dds_domainid_t)atoi(words[1]) : 0;
  const dds_entity_t me = dds_create_participant(domain, NULL, NULL);
  const dds_entity_t control =
      dds_create_topic(me, &kilotwin_open_RunControl_desc, "kilotwin/run_control", NULL, NULL);
  const dds_entity_t status =
      dds_create_topic(me, &kilotwin_open_RunStatus_desc, "kilotwin/run_status", NULL, NULL);
  const dds_entity_t writer = dds_create_writer(me, control, NULL, NULL); /* reliable by default */
  dds_qos_t* latest = dds_create_qos();
  dds_qset_reliability(latest, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(latest, DDS_DURABILITY_TRANSIENT_LOCAL);
  const dds_entity_t reader = dds_create_reader(me, status, latest, NULL);
  dds_delete_qos(latest);
  if (writer < 0 || reader < 0) return 1;

  const kilotwin_open_RunControl stop = {
      .client = "example", .run = 0, .request = (uint32_t)time(NULL), .command = kilotwin_open_STOP_RUN};
  static kilotwin_open_RunStatus now;
  void* samples[] = {&now};
  dds_sample_info_t info;
  int found = 0;
  for (int turn = 1; now.phase != kilotwin_open_ENDED; ++turn) {
    while (dds_take(reader, samples, &info, 1, 1) > 0) {
      if (!info.valid_data) continue;
      found = 1;
      printf("%s is at tick %lld\n", now.name, (long long)now.tick);
    }
    if (!found && turn == 15) /* 3 s */
      fprintf(stderr, "no run found on domain %u; set CYCLONEDDS_URI to what `kilotwin config` prints\n", domain);
    dds_write(writer, &stop);
    dds_sleepfor(DDS_MSECS(200));
  }
  return dds_delete(me) == DDS_RETCODE_OK ? 0 : 1;
}
